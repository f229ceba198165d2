"""Streams that are ended come to an end, by token or all, and no other answer does."""

import asyncio

import anyio
import pytest

from device.web.entrance.open_answers import OpenAnswers

START = {"type": "http.response.start", "status": 200, "headers": []}
LAST = {"type": "http.response.body", "body": b"", "more_body": False}


async def endless(send):
    await send(START)
    while True:
        await send({"type": "http.response.body", "body": b"x", "more_body": True})
        await asyncio.sleep(0)


class Listener:
    """A client, with what was sent to it."""

    def __init__(self):
        self.sent, self.hears = [], asyncio.Event()

    async def send(self, message):
        self.sent.append(message)
        if message.get("more_body"):
            self.hears.set()


async def streaming(answers, token_id, run=endless):
    listener = Listener()
    task = asyncio.create_task(answers.answer(token_id, listener.send, run))
    await listener.hears.wait()
    return listener, task


def test_a_token_that_holds_no_more_ends_its_streams_alone():
    async def story():
        answers = OpenAnswers()
        gone, ended = await streaming(answers, "t-1")
        kept, goes_on = await streaming(answers, "t-2")
        await asyncio.to_thread(answers.end_of, "t-1")
        await ended
        assert gone.sent[-1] == LAST
        before = len(kept.sent)
        await asyncio.sleep(0.01)
        assert len(kept.sent) > before
        answers.end_all()
        await goes_on
        assert kept.sent[-1] == LAST
        assert answers._under_way == {}

    asyncio.run(story())


def test_a_stream_ends_with_the_days_of_its_token():
    async def story():
        listener = Listener()
        await OpenAnswers().answer("t-1", listener.send, endless, valid_s=0.05)
        assert listener.sent[-1] == LAST

    asyncio.run(story())


def failing_with(error, *, begun):
    async def fail(send):
        if begun:
            await send(START)
            await send({"type": "http.response.body", "body": b"x", "more_body": True})
        raise ExceptionGroup("of a stream", [ExceptionGroup("within it", [error])])

    return fail


def test_a_client_that_leaves_in_the_middle_of_a_stream_is_no_error():
    """FastAPI raises it where a client leaves while much is being told, as after a long absence."""
    left = failing_with(anyio.BrokenResourceError(), begun=True)
    asyncio.run(OpenAnswers().answer("t-1", Listener().send, left))


@pytest.mark.parametrize(("error", "begun"), [(ValueError("other"), True), (anyio.BrokenResourceError(), False)])
def test_any_other_error_of_a_stream_is_one(error, begun):
    with pytest.raises(ExceptionGroup):
        asyncio.run(OpenAnswers().answer("t-1", Listener().send, failing_with(error, begun=begun)))


def test_an_answer_that_has_not_begun_is_left_to_end_by_itself():
    """A press may have been started by it."""

    async def story():
        answers, listener, go = OpenAnswers(), Listener(), asyncio.Event()

        async def slow(send):
            await go.wait()
            await send(START)
            await send(LAST)

        task = asyncio.create_task(answers.answer("t-1", listener.send, slow))
        await asyncio.sleep(0)
        answers.end_all()
        go.set()
        await task
        assert listener.sent == [START, LAST]

    asyncio.run(story())


def test_a_client_that_does_not_read_is_not_waited_for():
    async def story():
        answers, never, begun = OpenAnswers(), asyncio.Event(), asyncio.Event()

        async def stuck(message):
            if message["type"] == "http.response.body":
                begun.set()
                await never.wait()

        task = asyncio.create_task(answers.answer(None, stuck, endless))
        await begun.wait()
        answers.end_all()
        await task

    asyncio.run(story())


def test_whoever_else_cancels_is_heard():
    async def story():
        answers = OpenAnswers()
        _, task = await streaming(answers, None)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert answers._under_way == {}

    asyncio.run(story())


def test_after_the_server_has_ended_nobody_is_left_to_be_told():
    answers = OpenAnswers()
    answers.end_of("t-1")

    async def story():
        async def short(send):
            await send(START)
            await send(LAST)

        await answers.answer("t-1", Listener().send, short)

    asyncio.run(story())
    answers.end_of("t-1")

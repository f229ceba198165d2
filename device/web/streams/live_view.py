"""What the camera sees, as JPEGs that replace each other (MJPEG): to see dirt, light and focus, not to measure.

It shows the frames that the procedure takes and asks the camera for none. Each is encoded once for all clients, at most
five a second, and none while nobody looks.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable

import cv2
import numpy as np
from fastapi import FastAPI
from fastapi.responses import StreamingResponse
from numpy.typing import NDArray

from device.instrument.procedure import Procedure
from device.web.contract import LIVE, media

INTERVAL_S = 0.2
REPEAT_S = 1.0
"""A picture that stays is sent again so often: then the server notices that its client has gone."""
QUALITY_PERCENT = 80
BOUNDARY = b"--frame\r\n"

_Counts = NDArray[np.uint8]


def part_of(counts: _Counts) -> bytes:
    """Return a frame [height_px, width_px] as a part of the stream, its counts as they are: 0 black and 255 white.

    The next part's boundary ends it at once: browsers show a picture when they have seen that.
    """
    jpeg = cv2.imencode(".jpg", counts, (cv2.IMWRITE_JPEG_QUALITY, QUALITY_PERCENT))[1].tobytes()
    return b"Content-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%b\r\n%b" % (len(jpeg), jpeg, BOUNDARY)


class LiveView:
    """The newest frame as a part of the stream, encoded when somebody looks."""

    def __init__(self, newest: Callable[[], _Counts | None], *, clock: Callable[[], float] = time.monotonic) -> None:
        """Take what returns the frame that was taken last, and never writes into it."""
        self._newest, self._clock, self._encoding = newest, clock, asyncio.Lock()
        self._shown: _Counts | None = None
        self._part, self._shown_s = b"", 0.0

    async def part(self) -> bytes:
        """Return the present part, b"" before the first frame; the same one as long as there is no newer frame."""
        async with self._encoding:
            frame, now_s = self._newest(), self._clock()
            if frame is not None and frame is not self._shown and now_s - self._shown_s >= INTERVAL_S:
                self._part = await asyncio.to_thread(part_of, frame)
                self._shown, self._shown_s = frame, now_s
            return self._part

    async def parts(self) -> AsyncIterator[bytes]:
        """Yield each new part, and an old one again now and then, until the client goes."""
        yield BOUNDARY
        sent, sent_s = b"", self._clock()
        while True:
            part = await self.part()
            if part and (part is not sent or self._clock() - sent_s >= REPEAT_S):
                sent, sent_s = part, self._clock()
                yield part
            await asyncio.sleep(INTERVAL_S)


def add_live_view(app: FastAPI, api: str, procedure: Procedure) -> None:
    """Add the route below `api` of the live picture."""

    def newest() -> _Counts | None:
        taken = procedure.bench.newest
        return None if taken is None else taken.counts

    view = LiveView(newest)

    @app.get(
        f"{api}/live.mjpeg",
        response_class=StreamingResponse,
        responses=media(LIVE, "JPEGs, each in place of the one before."),
        tags=["status"],
    )
    async def stream_live_view() -> StreamingResponse:
        """Stream the frames that are being taken, five a second at most."""
        return StreamingResponse(view.parts(), media_type=f"{LIVE}; boundary=frame")

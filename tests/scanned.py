"""What a USB scanner types, in a real browser."""

from playwright.sync_api import Page


def scan(page: Page, code: str):
    """Press keys as a scanner does, 4 ms apart by their own time, however slow the machine is, and Enter at the end."""
    keyboard, begun_s = page.context.new_cdp_session(page), page.evaluate("Date.now()") / 1000
    for number, key in enumerate([*code, "Enter"]):
        of_key = {"key": key, "timestamp": begun_s + 0.004 * number}
        text = "\r" if key == "Enter" else key
        keyboard.send("Input.dispatchKeyEvent", {"type": "keyDown", "text": text} | of_key)
        keyboard.send("Input.dispatchKeyEvent", {"type": "keyUp"} | of_key)

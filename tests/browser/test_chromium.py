"""The browser's driver sees what a page shows, asks for and complains of."""

from pathlib import Path
from urllib.parse import quote

from tests.browser.chromium import PHONE, Chromium

VIEWPORT = "<meta name=viewport content='width=device-width'>"
PAGE = (
    VIEWPORT
    + "<title>one</title><p id=p>two</p><script>console.error('told'); undefined_name</script>"
)


def test_page_is_driven_and_its_complaints_are_noted(tmp_path: Path) -> None:
    with Chromium() as browser:
        page = browser.open("data:text/html," + quote(PAGE))
        assert page.evaluate("document.title") == "one"
        assert page.evaluate("Promise.resolve(innerWidth)") == 1366
        page.resize(PHONE)
        assert page.evaluate("innerHeight") == 844
        page.wait_for("document.querySelector('#p').textContent === 'two'")
        page.screenshot(tmp_path / "page.png")
        assert (tmp_path / "page.png").read_bytes().startswith(b"\x89PNG")
        told, thrown = page.console_errors
        assert told == "told"
        assert "undefined_name is not defined" in thrown
        page.evaluate("fetch('http://127.0.0.1:9/nobody').catch(() => 0)")
        assert "http://127.0.0.1:9/nobody" in page.requests

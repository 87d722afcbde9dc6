"""The list of `host preflight` on its page, at two sizes."""

from pathlib import Path

from tests.browser.chromium import PHONE, Chromium
from tests.browser.served_page import served_page


def test_the_list_turns_green_on_a_laptop_and_on_a_phone_and_asks_nobody(tmp_path: Path) -> None:
    with served_page(tmp_path, "preflight", "sim:walk@8x") as walk, Chromium() as browser:
        page = browser.open(walk.url)
        page.wait_for("document.querySelectorAll('#preflight-items .seen').length > 3", 120)
        page.screenshot(tmp_path / "laptop.png")
        page.resize(PHONE)
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
        page.wait_for("document.querySelector('#go-text').textContent === 'GO'", 240)
        page.screenshot(tmp_path / "phone.png")
        assert walk.strangers(page.requests) == []
        assert page.console_errors == []
    assert "Traceback" not in walk.err

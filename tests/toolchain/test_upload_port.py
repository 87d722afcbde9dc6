"""An upload without a board fails at once, not after a minute of time-outs."""

from __future__ import annotations

import upload_port


def test_only_a_port_on_usb_may_be_a_board() -> None:
    assert upload_port.complaint([None, 0x2341]) == ""
    for vendors in ([], [None], [None, None]):
        said = upload_port.complaint(vendors)
        assert "no board found" in said
        assert "--upload-port" in said
        assert "\n" not in said

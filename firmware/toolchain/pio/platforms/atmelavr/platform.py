"""The class PlatformIO loads for `platform = atmelavr` where its registry is out of reach."""

from platformio.platform.base import PlatformBase


class AtmelavrPlatform(PlatformBase):
    """AVR boards with the distribution's tools."""

    def is_embedded(self) -> bool:
        """Say yes: PlatformIO would look for an uploader package, and there is none."""
        return True

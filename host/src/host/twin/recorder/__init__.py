"""The firmware flown: as a library of this computer or in the chip simulator."""

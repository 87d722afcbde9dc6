"""The recorder's firmware in a flight: as a library of this computer or on a simulated chip."""

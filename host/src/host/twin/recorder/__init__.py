"""The recorder's firmware run through a flight: as a library of this computer or on the simulated
chip.
"""

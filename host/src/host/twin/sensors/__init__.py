"""Sensor models: from true motion to volts, edges and bytes, each with the real part's delay."""

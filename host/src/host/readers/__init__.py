"""Logs of other autopilots: ULog, DataFlash, tlog to columns of our names, units and signs."""

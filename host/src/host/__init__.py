"""Flight-test host tool: decode logs, fly virtual tests, identify the aircraft."""

"""The faults an aircraft may meet, injected into the flight image in flight."""

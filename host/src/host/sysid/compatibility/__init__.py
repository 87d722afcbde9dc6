"""Do the sensors agree with each other? Flight-path reconstruction and corrections."""

"""Bytes to frames: schema, blocks and their proof, sessions chosen, telemetry envelopes."""

"""The servo of an aircraft whose own nobody measured: a standard servo of a trainer."""

BANDWIDTH_HZ = 8.0
BANDWIDTH_SOURCE = "as measured for servos of the Ultra Stick 25e"
RATE_LIMIT_RADPS = 5.236
RATE_LIMIT_SOURCE = "Futaba S3010, 0.20 s per 60 deg at 4.8 V (thesis)"

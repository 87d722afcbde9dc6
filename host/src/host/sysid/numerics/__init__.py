"""What estimators share: kernels, residuals and slopes, memory of noise, Riccati equation."""

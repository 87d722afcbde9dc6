"""What estimators share: responses and sensitivities, likelihoods, AR noise, Riccati equation."""

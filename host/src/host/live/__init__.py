"""The flight as it is received: captured, decoded, shown. Listens only; sends nothing up."""

"""Make protocol/generated/ from frames.toml and cases.toml. Standard library only."""

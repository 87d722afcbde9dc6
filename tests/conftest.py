"""No test depends on time or chance: Hypothesis draws the same cases, at any speed, every run."""

from hypothesis import settings

settings.register_profile("house", deadline=None, derandomize=True, database=None)
settings.load_profile("house")

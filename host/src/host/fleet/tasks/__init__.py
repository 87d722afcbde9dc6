"""Each flight by itself: what is asked of it, who runs it, and what becomes of one that fails."""

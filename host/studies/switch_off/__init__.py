"""Every step of identification switched off in turn: which of them improves anything?"""

"""Build a program with the compiler of this computer."""

from SCons.Script import Default, DefaultEnvironment

env = DefaultEnvironment()
Default([env.BuildProgram()])

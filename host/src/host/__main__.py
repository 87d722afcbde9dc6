"""Where ``host`` and ``python -m host`` begin: Ctrl-C is one line from the first import on."""

# Nothing is imported here but what the interpreter has loaded: there Ctrl-C is not ours yet.
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NoReturn


def run() -> int:
    """Run the command line as a program of its own and return its exit code."""
    try:
        import signal

        ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if ours:  # not of a program that ignores it, as behind `nohup`
            signal.signal(signal.SIGINT, _leave)
        from host.cli import main

        code = main()
        if ours:  # all is said: what follows is the end of the interpreter
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        return code
    except KeyboardInterrupt:  # before the handler stood
        _leave()


def _leave(*_: object) -> "NoReturn":
    """End at once: while modules are loaded nothing is begun that would want tidying up."""
    os.write(2, b"host: interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(run())

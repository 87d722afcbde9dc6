"""Read the results of a suite: doctest's on the PC, those of check.h on the AVR.

PlatformIO loads this class for `test_framework = custom`.
"""

import re

import click
from platformio.test.exception import UnitTestError
from platformio.test.result import TestCase, TestStatus
from platformio.test.runners.doctest import DoctestTestRunner

# Lines of check.h; simavr adds colour and a final dot to what the UART prints.
RESULT = re.compile(r"check: (pass|fail|note|done) (.*?)\.?\s*$")
COLOUR = re.compile(r"\x1b\[[0-9;]*m")
SANITIZER = re.compile(r"runtime error:|ERROR: \w+Sanitizer")
STATUS = {"pass": TestStatus.PASSED, "fail": TestStatus.FAILED}


class CustomTestRunner(DoctestTestRunner):
    """doctest without a library of PlatformIO's registry, and the AVR's printer."""

    EXTRA_LIB_DEPS = None

    def setup(self) -> None:
        """Start with no failed check; build only, where a program stands in for the board."""
        super().setup()
        self._notes: list[str] = []
        self._done = False
        self._dying = False
        section = f"env:{self.test_suite.env_name}"
        if self.project_config.get(section, "test_testing_command"):
            self.options.without_uploading = True

    def stage_testing(self) -> None:
        """Run the suite; an empty one is an error, and so is one that stops half-way on the AVR."""
        super().stage_testing()
        if not self.test_suite.cases:
            raise UnitTestError("no test case ran")
        if self.platform.is_embedded() and not self._done:
            raise UnitTestError("the suite did not reach its end: crash, reset or endless loop")

    def on_testing_line_output(self, line: str) -> None:
        """Turn one line of output into a result, if it is one."""
        if not self.platform.is_embedded():
            # The words of a sanitizer are the last ones of a program: show them to the end.
            self._dying = self._dying or SANITIZER.search(line) is not None
            if self._dying:
                click.echo(line, nl=False)
                return
            super().on_testing_line_output(line)
            return
        found = RESULT.search(COLOUR.sub("", line))
        if self.options.verbose or not found:
            click.echo(line, nl=False)
        if not found:
            return
        word, text = found.groups()
        if word == "note":
            self._notes.append(text)
        elif word == "done":
            self._done = True
            self.test_suite.on_finish()
        else:
            notes = "; ".join(self._notes)
            case = TestCase(
                name=text, status=STATUS[word], message=notes or None, stdout="\n".join(self._notes)
            )
            self._notes = []
            self.test_suite.add_case(case)
            click.echo(case.humanize())

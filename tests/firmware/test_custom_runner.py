"""Read the results of a suite: doctest's on the PC, those of check.h on the AVR.

PlatformIO loads this class for `test_framework = custom`.
"""

import re

import click
from platformio.test.result import TestCase, TestStatus
from platformio.test.runners.doctest import DoctestTestRunner

# Lines of check.h; simavr adds colour and a final dot to what the UART prints.
RESULT = re.compile(r"check: (pass|fail|note|done) (.*?)\.?\s*$")
COLOUR = re.compile(r"\x1b\[[0-9;]*m")
STATUS = {"pass": TestStatus.PASSED, "fail": TestStatus.FAILED}


class CustomTestRunner(DoctestTestRunner):
    """doctest without a library of PlatformIO's registry, and the AVR's printer."""

    EXTRA_LIB_DEPS = None

    def setup(self) -> None:
        """Start with no failed check; build only, where a program stands in for the board."""
        super().setup()
        self._notes: list[str] = []
        section = f"env:{self.test_suite.env_name}"
        if self.project_config.get(section, "test_testing_command"):
            self.options.without_uploading = True

    def on_testing_line_output(self, line: str) -> None:
        """Turn one line of output into a result, if it is one."""
        if not self.platform.is_embedded():
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
            self.test_suite.on_finish()
        else:
            case = TestCase(name=text, status=STATUS[word], message="; ".join(self._notes) or None)
            self._notes = []
            self.test_suite.add_case(case)
            click.echo(case.humanize())

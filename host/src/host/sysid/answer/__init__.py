"""What is said, drawn and saved of an estimate.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.answer.json_document import answer_document, json_text
    from host.sysid.answer.marks import CAREFUL, MARKS, TRUSTED
    from host.sysid.answer.output_files import OutputPaths, check_outputs
    from host.sysid.answer.truth_comparison import read_truth, true_coefficients
    from host.sysid.answer.verdict import verdict_lines, verdict_of

__all__ = [
    "CAREFUL",
    "MARKS",
    "TRUSTED",
    "OutputPaths",
    "answer_document",
    "check_outputs",
    "json_text",
    "read_truth",
    "true_coefficients",
    "verdict_lines",
    "verdict_of",
]

__getattr__ = lazily(
    __name__,
    {
        "CAREFUL": "marks",
        "MARKS": "marks",
        "OutputPaths": "output_files",
        "TRUSTED": "marks",
        "answer_document": "json_document",
        "check_outputs": "output_files",
        "json_text": "json_document",
        "read_truth": "truth_comparison",
        "true_coefficients": "truth_comparison",
        "verdict_lines": "verdict",
        "verdict_of": "verdict",
    },
)

"""What is said, drawn and saved of an estimate.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.answer.json_document import answer_document, json_text
    from host.sysid.answer.marks import CAREFUL, MARKS, TRUSTED, Verdict
    from host.sysid.answer.output_files import OutputPaths, check_outputs
    from host.sysid.answer.truth_comparison import read_truth, true_coefficients
    from host.sysid.answer.verdict import doubted_by_findings, judge

__all__ = [
    "CAREFUL",
    "MARKS",
    "TRUSTED",
    "OutputPaths",
    "Verdict",
    "answer_document",
    "check_outputs",
    "doubted_by_findings",
    "json_text",
    "judge",
    "read_truth",
    "true_coefficients",
]

__getattr__ = lazily(
    __name__,
    {
        "CAREFUL": "marks",
        "MARKS": "marks",
        "OutputPaths": "output_files",
        "TRUSTED": "marks",
        "Verdict": "marks",
        "answer_document": "json_document",
        "check_outputs": "output_files",
        "doubted_by_findings": "verdict",
        "json_text": "json_document",
        "judge": "verdict",
        "read_truth": "truth_comparison",
        "true_coefficients": "truth_comparison",
    },
)

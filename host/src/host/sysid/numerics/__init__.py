"""What estimators share: responses and sensitivities, likelihoods, AR noise, Riccati equation.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.numerics.ar_noise import ArNoise, autocovariance
    from host.sysid.numerics.discretisation import discretise
    from host.sysid.numerics.equation_filter_problem import EquationFilterProblem
    from host.sysid.numerics.filter_problem import FilterProblem
    from host.sysid.numerics.innovation_problem import InnovationLikelihood
    from host.sysid.numerics.model_problems import output_problem
    from host.sysid.numerics.nonlinear_problem import NonlinearProblem
    from host.sysid.numerics.output_error import covariance_of_free, minimise
    from host.sysid.numerics.output_error_problem import OutputProblem

__all__ = [
    "ArNoise",
    "EquationFilterProblem",
    "FilterProblem",
    "InnovationLikelihood",
    "NonlinearProblem",
    "OutputProblem",
    "autocovariance",
    "covariance_of_free",
    "discretise",
    "minimise",
    "output_problem",
]

__getattr__ = lazily(
    __name__,
    {
        "ArNoise": "ar_noise",
        "EquationFilterProblem": "equation_filter_problem",
        "FilterProblem": "filter_problem",
        "InnovationLikelihood": "innovation_problem",
        "NonlinearProblem": "nonlinear_problem",
        "OutputProblem": "output_error_problem",
        "autocovariance": "ar_noise",
        "covariance_of_free": "output_error",
        "discretise": "discretisation",
        "minimise": "output_error",
        "output_problem": "model_problems",
    },
)

"""System identification: from a maneuver to a model with honest uncertainties.

The front door is `fit(method, model, maneuvers)`; a `LinearModel` says what is known and what is
free, a `Maneuver` holds the samples, a `FitResult` is the answer of every method alike.
"""

from host.sysid.estimators.estimation_method import Method as Method
from host.sysid.estimators.estimation_method import MethodOption as MethodOption
from host.sysid.estimators.estimation_method import number as number
from host.sysid.estimators.method_registry import fit as fit
from host.sysid.estimators.method_registry import methods as methods
from host.sysid.models.fit_result import FitResult as FitResult
from host.sysid.models.maneuver import Maneuver as Maneuver
from host.sysid.models.state_space_model import LinearModel as LinearModel
from host.sysid.models.state_space_model import Parameter as Parameter
from host.sysid.models.state_space_model import Term as Term

"""System identification: from a maneuver to a model with honest uncertainties.

The front door is `fit(method, model, maneuvers)`; a `LinearModel` says what is known and what is
free, a `Maneuver` holds the samples, a `FitResult` is the answer of every method alike.
"""

from host.sysid.estimators.fit import fit as fit
from host.sysid.estimators.fit import methods as methods
from host.sysid.models.maneuver import Maneuver as Maneuver
from host.sysid.models.model import LinearModel as LinearModel
from host.sysid.models.model import Parameter as Parameter
from host.sysid.models.model import Term as Term
from host.sysid.models.result import FitResult as FitResult

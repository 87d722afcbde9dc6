"""Templates of linear models with the axes that they need; methods of more than one stage."""

AXIS_OF = {
    "longitudinal": ("elevator_rad",),
    "short-period": ("elevator_rad",),
    "phugoid": ("elevator_rad",),
    "lateral": ("aileron_rad", "rudder_rad"),
    "roll": ("aileron_rad",),
    "dutch-roll": ("rudder_rad",),
}
# Output error takes turbulence for sensor noise. Simulated flights of the demonstration card, error
# of Cm_alpha, Cm_q, Cm_de: 5, 10, 7 % by white output error, 2, 3, 3 % with the gust as a state.
# Laterally, rms over eight flights: L_p 5.4, L_da 4.5, N_dr 5.6 % and 2.6, 3.2, 1.3 %.
GUST = "filter-error-gust"
DEFAULT_METHOD = "flight"
STAGED = {
    "flight": "gust filter where alpha is a measured state; beta too, of our log only with an"
    " aircraft file, of dutch-roll where the data show gusts (default)",
    GUST: "filter error with the gust as a state, delays estimated with it",
}

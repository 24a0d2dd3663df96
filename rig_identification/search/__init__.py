"""What is left out, searched by one principle: the likeliest model, with the wrench that it still lacks.

A rigid-body model that lacks something large soon moves out of step with the recordings, and its derivatives
there say nothing. With a random wrench in the model (levels.py) its motion follows the data (path.py), and
residuals are nearly linear in every parameter. The evidence tells how strong the wrench has to be, from what
carries anything to none (ladder.py). Every effect is screened where the model at hand stands; the best are
fitted, each at its own level (expand.py). The likeliest model is expanded next (search.py), until whole runs,
held-out ones among them, are explained (whole.py). What acts for seconds stands out of it (events.py);
what nothing explains is told from the wrench (unexplained.py).
"""

"""What is left out, searched with the discrepancy itself as a random wrench: from near the data to the model.

A rigid-body model that lacks something large soon moves out of step with the recordings, and its derivatives
there say nothing. With a random wrench in the model (levels.py) its motion follows the data (path.py), and
residuals are nearly linear in every parameter. The evidence tells how strong the wrench has to be; a fit
walks it down (ladder.py), every effect is screened where the model at hand stands, and what is found takes
the wrench's place until none is needed (search.py).
"""

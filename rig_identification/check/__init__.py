"""The first stage of an identification: what was set up wrongly, found before any model is fitted."""

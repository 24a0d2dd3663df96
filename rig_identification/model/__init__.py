"""Forward model: one set of equations for simulator and estimator."""

"""What identification takes: regressors, inertial and base parameters."""

"""`python -m symdyn.bench.robots`: robots from files beside Pinocchio, agreement and times."""

"""A rod while its nodes move: paths of control, the branch followed along them, folds, and what comes after."""

"""calibrate: which parameters make the solver's wire lie where the traced ones do, and which of them the traces show?"""

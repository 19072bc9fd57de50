"""calibrate: which parameters lay the solver's wire where the traced ones are, and which of them do the traces show?"""

"""Which rules, goal classes, actions and skills a set of recorded runs has used."""

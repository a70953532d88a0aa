"""Coverage: the rules, goal classes, actions and skills that a set of recorded runs has used."""

"""CLIPS environments with the behaviour of Fawkes': CLIPS 6.4 adapted to 6.30."""

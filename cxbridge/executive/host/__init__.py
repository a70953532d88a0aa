"""CLIPS environments that behave as Fawkes' do: CLIPS 6.4 made to act like 6.30."""

"""What the server offers, one module a component of Fawkes' protocol."""

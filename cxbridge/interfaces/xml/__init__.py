"""Reading of Fawkes' XML definitions into schemas."""

"""Messages of Fawkes' network protocol as typed values, one module per component, without I/O."""

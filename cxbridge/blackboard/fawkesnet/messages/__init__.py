"""Messages of Fawkes' network protocol: bytes to typed values and back, one module a component; no I/O."""

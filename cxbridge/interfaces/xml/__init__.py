"""Reads interface definitions: Fawkes' XML to schemas, with every mistake explained."""

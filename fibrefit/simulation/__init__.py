"""From a system of laws and a record's conditions to what the sensors would have read."""

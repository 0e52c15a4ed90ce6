//! A model against recordings: what it says of a right model, of a wrong one, and of a shifted clock.

"""What a rod does while a plan is carried out: as a real one would, for pictures, with the errors of real nodes."""

"""Problems, their equations of motion, and reference solutions."""

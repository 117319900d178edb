"""Problems with their equations of motion, and reference solutions."""

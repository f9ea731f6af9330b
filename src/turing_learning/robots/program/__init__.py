"""The program of the PC: a laboratory's file, its states P1 to P5, and a look at everything before."""

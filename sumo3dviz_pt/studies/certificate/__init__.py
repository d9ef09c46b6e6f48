"""The certificate of a study: films of a pair differ where their factor acts, and nowhere else."""

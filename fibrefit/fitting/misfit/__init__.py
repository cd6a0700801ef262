"""What follows where residuals are more than noise: wider error bars, and whether records agree."""

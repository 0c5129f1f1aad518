"""The analysis of a field test: questionnaire answers on 7-point scales, compared between the conditions of a robot."""

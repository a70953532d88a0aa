; functions.clp - values of the domain's functions, for the features `pddl-parser` and `problem-expert`.

(deftemplate problem-function
  "The value of a numeric function for some objects."
  (slot name (type SYMBOL)) (multislot param-values) (slot value (type FLOAT)))

; functions.clp - the values of the domain's functions, of the features `pddl-parser` and `problem-expert`.

(deftemplate problem-function
  "The value of a numeric function: one fact for each function with its objects."
  (slot name (type SYMBOL)) (multislot param-values) (slot value (type FLOAT)))

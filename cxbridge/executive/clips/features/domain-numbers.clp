; domain-numbers.clp - numbers of the domain: comparisons in conditions, changes by effects
;
; Loaded with the first domain that has functions. The feature pddl-parser evaluates comparisons
; and effects: domain-comparison-holds and domain-numbers-change.

(defrule domain-numbers-begin
  "The domain has functions."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (not (domain-numbers))
  =>
  (assert (domain-numbers)))

(defrule domain-numbers-changed
  "Count a new function value. The salience is above that of comparisons, so that these wait for all
   new values."
  (declare (salience (+ ?*SALIENCE-DOMAIN-CHECK* 10)))
  ?function <- (problem-function)
  ?numbers <- (domain-numbers (revision ?revision) (newest ?newest&:(< ?newest (fact-index ?function))))
  =>
  (modify ?numbers (revision (+ ?revision 1)) (newest (fact-index ?function))))

(defrule domain-check-comparison
  "Evaluate a comparison once after each change of function values (revision)."
  (declare (salience ?*SALIENCE-DOMAIN-CHECK*))
  ?leaf <- (grounded-pddl-comparison (predicate-id ?id) (names $?names) (values $?values)
                                     (tree ?grounded) (place ?place)
                                     (satisfied ?before) (revision ?revision))
  (domain-comparison (predicate-id ?id) (text ?text))
  (domain-numbers (revision ?current-revision&~?revision))
  =>
  (bind ?holds (domain-comparison-holds ?text ?names ?values))
  (modify ?leaf (satisfied ?holds) (revision ?current-revision))
  (if (neq ?holds ?before) then (grounded-pddl-tree-set ?grounded ?place ?holds)))

(defrule domain-numbers-apply
  "The salience is FIRST, as for the other effects: no rule fires between the effects of an action."
  (declare (salience ?*SALIENCE-FIRST*))
  ?due <- (domain-numbers-due (operator ?operator) (duration ?duration)
                              (names $?names) (values $?values))
  =>
  (retract ?due)
  (domain-numbers-change ?operator ?names ?values ?duration))

; domain-grounding.clp - grounded preconditions of plan-actions
;
; The precondition of an action is grounded once, before its execution. Afterwards only changes of
; its atoms need work, and only for the nodes of the formula whose truth changes. The grounding is
; retracted with the action.

; --- grounding

(deftemplate grounded-pddl-tree
  "A pddl-formula-tree in one grounding: a fact address for each node, in the tree's order."
  (slot grounding) (slot root) (slot tree) (slot revision)
  (multislot facts) (multislot leaves)
  ; the number of satisfied children of each node; the satisfied root formulas
  (multislot counts) (multislot satisfied)
  ; the pddl-grounding, and whether it is retracted when no plan-action refers to it
  (slot grounding-fact) (slot of-action))

(deftemplate grounded-pddl-leaf
  "The ground atom of a leaf (place) of a grounded tree."
  (slot key) (multislot values) (slot tree) (slot place) (slot satisfied (default FALSE)))

(deftemplate grounded-pddl-comparison
  "The comparison of numbers of a leaf (place) of a grounded tree; domain-numbers.clp evaluates it."
  (slot predicate-id) (multislot names) (multislot values) (slot tree) (slot place)
  ; the domain-numbers.revision at the evaluation
  (slot satisfied (default FALSE)) (slot revision (default -1)))

(deftemplate domain-met-conditions
  "The conditional effects of a successful action that apply."
  (slot grounding) (multislot effects))

(deffunction grounded-pddl-tree-set
  "Set a leaf of a grounded tree, and update the nodes above whose truth changes."
  (?grounded ?place ?value)
  (bind ?tree (fact-slot-value ?grounded tree))
  (bind ?facts (fact-slot-value ?grounded facts))
  (bind ?kinds (fact-slot-value ?tree kinds))
  (bind ?parents (fact-slot-value ?tree parents))
  (bind ?counts (fact-slot-value ?grounded counts))
  (while TRUE do
    (modify (nth$ ?place ?facts) (is-satisfied ?value))
    (bind ?parent (nth$ ?place ?parents))
    (if (= ?parent 0) then
      (bind ?roots (fact-slot-value ?grounded satisfied))
      (bind ?id (nth$ ?place (fact-slot-value ?tree ids)))
      (bind ?roots (if ?value then (create$ ?roots ?id) else (delete-member$ ?roots ?id)))
      (modify ?grounded (counts ?counts) (satisfied ?roots))
      (return))
    (bind ?kind (nth$ ?parent ?kinds)) (bind ?count (nth$ ?parent ?counts))
    (bind ?size (nth$ ?parent (fact-slot-value ?tree sizes)))
    (bind ?before (pddl-node-truth ?kind ?count ?size))
    (bind ?count (if ?value then (+ ?count 1) else (- ?count 1)))
    (bind ?counts (replace$ ?counts ?parent ?parent ?count))
    (bind ?value (pddl-node-truth ?kind ?count ?size))
    (if (eq ?value ?before) then
      (modify ?grounded (counts ?counts))
      (return))
    (bind ?place ?parent)))

(deffunction domain-check-equality-arity (?predicate-id ?names ?values)
  (if (<> (length$ ?values) 2) then
    (assert (domain-error (error-type equality-must-have-exactly-two-parameters)
      (error-msg (str-cat "Predicate " ?predicate-id " is an equality precondition but has "
                          (length$ ?names) " parameters, should be 2."))))))

(deffunction pddl-formula-tree-ground
  "Ground each node of a tree. An atom counts as not satisfied until its lookup."
  (?tree ?names ?values ?grounding-fact ?of-action)
  (bind ?grounding (fact-slot-value ?grounding-fact id))
  (bind ?ids (fact-slot-value ?tree ids)) (bind ?sources (fact-slot-value ?tree sources))
  (bind ?truths (fact-slot-value ?tree truths)) (bind ?parents (fact-slot-value ?tree parents))
  (bind ?facts (create$)) (bind ?leaves (create$)) (bind ?roots (create$)) (bind ?equal (create$))
  (bind ?grounded (assert (grounded-pddl-tree
    (grounding ?grounding) (root (fact-slot-value ?tree root)) (tree ?tree)
    (revision (fact-slot-value ?tree revision))
    (grounding-fact ?grounding-fact) (of-action ?of-action))))
  (progn$ (?kind (fact-slot-value ?tree kinds))
    (bind ?id (nth$ ?kind-index ?ids)) (bind ?source (nth$ ?kind-index ?sources))
    (if (member$ ?kind (create$ predicate equality comparison))
     then
      (bind ?grounded-id (sym-cat grounded- ?id - ?grounding))
      (bind ?fact (assert (grounded-pddl-predicate
        (id ?grounded-id) (predicate-id ?id) (grounding ?grounding))))
      (bind ?terms (domain-build-ground-parameter-list
        (fact-slot-value ?source param-names) (fact-slot-value ?source param-constants)
        ?names ?values))
      (if (neq ?terms FALSE) then
        (switch ?kind
         (case predicate then
          (bind ?leaves (create$ ?leaves (assert (grounded-pddl-leaf
            (key (domain-atom-key (fact-slot-value ?source predicate) ?terms)) (values ?terms)
            (tree ?grounded) (place ?kind-index))))))
         (case comparison then
          (bind ?leaves (create$ ?leaves (assert (grounded-pddl-comparison
            (predicate-id ?id) (names (fact-slot-value ?source param-names)) (values ?terms)
            (tree ?grounded) (place ?kind-index))))))
         (default
          (domain-check-equality-arity ?grounded-id (fact-slot-value ?source param-names) ?terms)
          (if (and (= (length$ ?terms) 2) (eq (nth$ 1 ?terms) (nth$ 2 ?terms))) then
            (bind ?equal (create$ ?equal ?kind-index))))))
     else
      (bind ?fact (assert (grounded-pddl-formula
        (id (sym-cat grounded- ?id - (gensym*))) (formula-id ?id) (grounding ?grounding)
        (is-satisfied (nth$ ?kind-index ?truths)))))
      (if (and (= (nth$ ?kind-index ?parents) 0) (nth$ ?kind-index ?truths)) then
        (bind ?roots (create$ ?roots ?id))))
    (bind ?facts (create$ ?facts ?fact)))
  (modify ?grounded (facts ?facts) (leaves ?leaves) (satisfied ?roots)
                    (counts (fact-slot-value ?tree counts)))
  (progn$ (?place ?equal) (grounded-pddl-tree-set ?grounded ?place TRUE)))

(deffunction pddl-grounding-for-tree
  "A new pddl-grounding, named after the first root formula of a tree."
  (?tree ?names ?values)
  (return (assert (pddl-grounding
    (id (sym-cat grounding- (nth$ 1 (fact-slot-value ?tree ids)) - (gensym*)))
    (param-names ?names) (param-values ?values)))))

(deffunction grounded-pddl-tree-drop
  "Retract a grounded tree. The tree and its leaves refer to each other, so CLIPS would not free them."
  (?grounded)
  (bind ?facts (create$ (fact-slot-value ?grounded leaves) (fact-slot-value ?grounded facts)))
  (modify ?grounded (leaves) (facts))
  (retract ?grounded)
  (progn$ (?fact ?facts) (if (fact-existp ?fact) then (retract ?fact))))

(deffunction ground-pddl-formula
  "Ground the formulas that are part-of parent-id, in a new grounding if grounding-id is nil.
   Return the id of the grounding; nil if there are no formulas."
  (?parent-id ?param-names ?param-values ?grounding-id)
  (bind ?tree FALSE)
  (do-for-fact ((?t pddl-formula-tree)) (eq ?t:root ?parent-id) (bind ?tree ?t))
  (if (not ?tree) then (bind ?tree (pddl-formula-tree-build ?parent-id)))
  (if (not ?tree) then (return ?grounding-id))
  (bind ?grounding FALSE)
  (do-for-fact ((?g pddl-grounding)) (eq ?g:id ?grounding-id) (bind ?grounding ?g))
  (if (not ?grounding) then
    (bind ?grounding (pddl-grounding-for-tree ?tree ?param-names ?param-values)))
  (pddl-formula-tree-ground ?tree ?param-names ?param-values ?grounding FALSE)
  (return (fact-slot-value ?grounding id)))

(deffunction ground-pddl-predicate
  "Assert the grounded-pddl-predicate facts of the predicates that are part-of parent-id."
  (?parent-id ?param-names ?param-values ?grounding-id)
  (do-for-all-facts ((?p pddl-predicate)) (eq ?p:part-of ?parent-id)
    (assert (grounded-pddl-predicate (id (sym-cat grounded- ?p:id - ?grounding-id))
                                     (predicate-id ?p:id) (grounding ?grounding-id)))))

(deffunction domain-retract-grounding
  "Retract a grounding with its facts; actions that refer to the grounding get a new one."
  (?action-precond)
  (delayed-do-for-all-facts ((?t grounded-pddl-tree)) (eq ?t:grounding ?action-precond)
    (grounded-pddl-tree-drop ?t))
  (delayed-do-for-all-facts ((?g pddl-grounding)) (eq ?g:id ?action-precond)
    (retract ?g))
  (do-for-all-facts ((?a plan-action))
      (and (neq ?action-precond nil) (eq ?a:precondition ?action-precond))
    (modify ?a (precondition nil))))

(defrule domain-amend-action-params
  "An action with values but no names gets the names from its operator."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 5)))
  ?action <- (plan-action (action-name ?operator) (param-names) (param-values ? $?))
  (domain-operator (name ?operator) (param-names $?names&:(> (length$ ?names) 0)))
  =>
  (modify ?action (param-names ?names)))

(defrule domain-ground-plan-action-precondition
  "Ground the precondition of an action before its execution."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  ?action <- (plan-action (precondition nil) (state ~FINAL&~FAILED) (action-name ?operator)
                          (param-names $?names) (param-values $?values))
  (domain-operator (name ?operator)
                   (param-names $?parameters&:(= (length$ ?parameters) (length$ ?names))))
  ?tree <- (pddl-formula-tree (root ?operator))
  =>
  (bind ?grounding (pddl-grounding-for-tree ?tree ?names ?values))
  (pddl-formula-tree-ground ?tree ?names ?values ?grounding TRUE)
  (modify ?action (precondition (fact-slot-value ?grounding id))))

(defrule domain-ground-effect-precondition
  "Ground the conditions of effects of an action that has succeeded."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator) (precondition ?id&~nil)
               (param-names $?names) (param-values $?values))
  (domain-operator-effects (operator ?operator) (conditional $? ?effect $?))
  ?tree <- (pddl-formula-tree (root ?effect))
  (not (grounded-pddl-tree (grounding ?id) (root ?effect)))
  ?grounding <- (pddl-grounding (id ?id))
  =>
  (pddl-formula-tree-ground ?tree ?names ?values ?grounding TRUE))

(defrule domain-ground-effect-precondition-alone
  "The same for an action without precondition: the effects' conditions get a new grounding."
  (declare (salience (- ?*SALIENCE-DOMAIN-GROUND* 1)))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator) (precondition nil)
                          (param-names $?names) (param-values $?values))
  (domain-operator-effects (operator ?operator) (conditional ?effect $?))
  ?tree <- (pddl-formula-tree (root ?effect))
  =>
  (bind ?grounding (pddl-grounding-for-tree ?tree ?names ?values))
  (pddl-formula-tree-ground ?tree ?names ?values ?grounding TRUE)
  (modify ?action (precondition (fact-slot-value ?grounding id))))

(defrule domain-ground-effect-precondition-begin
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator) (precondition ?id&~nil))
  (domain-operator-effects (operator ?operator) (conditional ? $?))
  (not (domain-met-conditions (grounding ?id)))
  =>
  (assert (domain-met-conditions (grounding ?id))))

; Clean-up. Other rules retract the facts of a retracted pddl-grounding.

(defrule domain-grounding-of-finished-action
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?action <- (plan-action (state FINAL|FAILED) (precondition ~nil))
  =>
  (modify ?action (precondition nil)))

(defrule domain-grounding-without-action
  "The action is finished, was retracted, or has another grounding."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  (grounded-pddl-tree (grounding ?id) (of-action TRUE) (grounding-fact ?grounding))
  (not (plan-action (precondition ?id)))
  =>
  (if (fact-existp ?grounding) then (retract ?grounding)))

(defrule domain-retract-grounding-for-plan-action-if-precondition-mismatch
  "The arguments of the action have changed."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?grounding <- (pddl-grounding (id ?id) (param-values $?values))
  (plan-action (precondition ?id) (param-values ~$?values))
  =>
  (retract ?grounding))

(defrule domain-grounding-is-outdated
  "The condition has changed."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  (grounded-pddl-tree (revision ?revision) (grounding ?id))
  (not (pddl-formula-tree (revision ?revision)))
  ?grounding <- (pddl-grounding (id ?id))
  =>
  (retract ?grounding))

(defrule domain-grounding-cleanup
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?grounded <- (grounded-pddl-tree (grounding ?id))
  (not (pddl-grounding (id ?id)))
  =>
  (grounded-pddl-tree-drop ?grounded))

(defrule domain-grounding-cleanup-conditions
  "The decision about conditional effects holds for one execution."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?met <- (domain-met-conditions (grounding ?id))
  (not (plan-action (precondition ?id)
                    (state EXECUTION-SUCCEEDED|SENSED-EFFECTS-WAIT|SENSED-EFFECTS-HOLD)))
  =>
  (retract ?met))

(defrule domain-grounding-cleanup-action
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?action <- (plan-action (precondition ?id&~nil))
  (not (pddl-grounding (id ?id)))
  =>
  (modify ?action (precondition nil)))

; --- checking

(defrule domain-check-grounded-predicate
  "A ground atom is satisfied if an equal domain-fact exists."
  (declare (salience ?*SALIENCE-DOMAIN-CHECK*))
  ?leaf <- (grounded-pddl-leaf (satisfied FALSE) (key ?key) (values $?values)
                               (tree ?grounded) (place ?place))
  (domain-true-atom (key ?key) (values $?values))
  =>
  (modify ?leaf (satisfied TRUE))
  (grounded-pddl-tree-set ?grounded ?place TRUE))

(defrule domain-check-if-predicate-is-unsatisfied
  (declare (salience ?*SALIENCE-DOMAIN-CHECK*))
  ?leaf <- (grounded-pddl-leaf (satisfied TRUE) (key ?key) (values $?values)
                               (tree ?grounded) (place ?place))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (modify ?leaf (satisfied FALSE))
  (grounded-pddl-tree-set ?grounded ?place FALSE))

; The rules on the truth of formulas wait until all atoms have been looked up.

(defrule domain-check-if-action-precondition-is-satisfied
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable FALSE) (precondition ?id&~nil) (action-name ?operator))
  (grounded-pddl-tree (grounding ?id) (root ?operator) (satisfied ?formula $?))
  =>
  (modify ?action (executable TRUE))
  (if (eq (fact-slot-value ?action state) PENDING) then
    (printout t "Action " (fact-slot-value ?action id) " is executable based on " ?formula crlf)))

(defrule domain-check-if-action-precondition-is-unsatisfied
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable TRUE) (precondition ?id&~nil) (action-name ?operator))
  (grounded-pddl-tree (grounding ?id) (root ?operator) (satisfied))
  =>
  (modify ?action (executable FALSE))
  (if (eq (fact-slot-value ?action state) PENDING) then
    (printout t "Action " (fact-slot-value ?action id) " is no longer executable" crlf)))

(defrule domain-check-if-action-is-executable-without-precondition
  "There is no grounding: no formula, no operator, or other parameters than the operator's."
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable FALSE) (precondition nil) (state ~FINAL&~FAILED))
  =>
  (modify ?action (executable TRUE)))

(defrule domain-check-effect-condition
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  (plan-action (state EXECUTION-SUCCEEDED) (precondition ?id&~nil) (action-name ?operator))
  (domain-operator-effects (operator ?operator) (conditional $? ?effect $?))
  (grounded-pddl-tree (grounding ?id) (root ?effect) (satisfied ? $?))
  ?met <- (domain-met-conditions (grounding ?id) (effects $?effects&~:(member$ ?effect ?effects)))
  =>
  (modify ?met (effects ?effects ?effect)))

; domain-grounding.clp - grounded preconditions of plan-actions
;
; The precondition of an action is grounded once, before its execution. Afterwards only changes of
; its atoms need work, and only for the nodes of the formula whose truth changes. The grounding is
; retracted when the action is finished or retracted.
;
; The rules fire in the order of their saliences, above and below that of grounding (4200):
;   +50   retract groundings of finished or changed actions and changed conditions, before the index of
;         the domain (+40 to +10, domain-index.clp) and the rules below make anything new
;   +5    add missing parameter names to actions, because grounding needs the names
;   0     ground preconditions; index facts and awaited atoms (domain-index.clp, domain-effects.clp)
;   -1    ground the effects' conditions of actions that have no precondition
;   -100  (checking) look up atoms, then (-101) decide which actions are executable

; --- grounding

(deftemplate grounded-pddl-tree
  "A pddl-formula-tree in one grounding."
  ; tree: the fact address of the pddl-formula-tree; revision: that of the tree at the grounding
  (slot grounding) (slot root) (slot tree) (slot revision)
  ; facts: the grounded-pddl-formula or grounded-pddl-predicate of each node, in the tree's order;
  ; leaves: the grounded-pddl-leaf and grounded-pddl-comparison facts
  (multislot facts) (multislot leaves)
  ; the number of satisfied children of each node; the ids of the satisfied root formulas
  (multislot counts) (multislot satisfied)
  ; the pddl-grounding, and whether it is retracted when no plan-action refers to it
  (slot grounding-fact) (slot of-action))

(deftemplate grounded-pddl-leaf
  "The ground atom of a leaf, the node at the position `place` of a grounded tree."
  (slot key) (multislot values) (slot tree) (slot place) (slot satisfied (default FALSE)))

(deftemplate grounded-pddl-comparison
  "The comparison of numbers of a leaf, the node at the position `place` of a grounded tree. The rules
   of domain-numbers.clp evaluate the comparison."
  (slot predicate-id) (multislot names) (multislot values) (slot tree) (slot place)
  ; the domain-numbers.revision at the evaluation; -1: not evaluated yet
  (slot satisfied (default FALSE)) (slot revision (default -1)))

(deftemplate domain-met-conditions
  "The names of the conditional effects that apply for the successful action with this grounding."
  (slot grounding) (multislot effects))

(deffunction grounded-pddl-tree-set
  "Set the leaf at ?place to ?is-satisfied, and update the nodes above whose truth changes."
  (?grounded ?place ?is-satisfied)
  (bind ?tree (fact-slot-value ?grounded tree))
  (bind ?facts (fact-slot-value ?grounded facts))
  (bind ?kinds (fact-slot-value ?tree kinds))
  (bind ?parents (fact-slot-value ?tree parents))
  (bind ?counts (fact-slot-value ?grounded counts))
  (while TRUE do
    (modify (nth$ ?place ?facts) (is-satisfied ?is-satisfied))
    (bind ?parent (nth$ ?place ?parents))
    ; the node is a root formula
    (if (= ?parent 0) then
      (bind ?satisfied-roots (fact-slot-value ?grounded satisfied))
      (bind ?id (nth$ ?place (fact-slot-value ?tree ids)))
      (bind ?satisfied-roots (if ?is-satisfied then (create$ ?satisfied-roots ?id)
                                               else (delete-member$ ?satisfied-roots ?id)))
      (modify ?grounded (counts ?counts) (satisfied ?satisfied-roots))
      (return))
    (bind ?kind (nth$ ?parent ?kinds)) (bind ?count (nth$ ?parent ?counts))
    (bind ?size (nth$ ?parent (fact-slot-value ?tree sizes)))
    (bind ?was-satisfied (pddl-node-truth ?kind ?count ?size))
    (bind ?count (if ?is-satisfied then (+ ?count 1) else (- ?count 1)))
    (bind ?counts (replace$ ?counts ?parent ?parent ?count))
    (bind ?is-satisfied (pddl-node-truth ?kind ?count ?size))
    (if (eq ?is-satisfied ?was-satisfied) then
      (modify ?grounded (counts ?counts))
      (return))
    (bind ?place ?parent)))

(deffunction domain-check-equality-arity
  "Assert a domain-error if an EQUALITY does not have two terms."
  (?predicate-id ?names ?values)
  (if (<> (length$ ?values) 2) then
    (assert (domain-error (error-type equality-must-have-exactly-two-parameters)
      (error-msg (str-cat "Predicate " ?predicate-id " is an equality precondition but has "
                          (length$ ?names) " parameters, should be 2."))))))

(deffunction pddl-formula-tree-ground
  "Ground each node of a tree. Atoms and comparisons count as not satisfied until rules evaluate
   them; equalities are decided at once. ?of-action is a slot of grounded-pddl-tree."
  (?tree ?names ?values ?grounding-fact ?of-action)
  (bind ?grounding (fact-slot-value ?grounding-fact id))
  (bind ?ids (fact-slot-value ?tree ids)) (bind ?sources (fact-slot-value ?tree sources))
  (bind ?truths (fact-slot-value ?tree truths)) (bind ?parents (fact-slot-value ?tree parents))
  (bind ?facts (create$)) (bind ?leaves (create$))
  (bind ?satisfied-roots (create$)) (bind ?equal-places (create$))
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
      ; a leaf with an unknown parameter stays unsatisfied
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
            (bind ?equal-places (create$ ?equal-places ?kind-index))))))
     else
      (bind ?fact (assert (grounded-pddl-formula
        (id (sym-cat grounded- ?id - (gensym*))) (formula-id ?id) (grounding ?grounding)
        (is-satisfied (nth$ ?kind-index ?truths)))))
      (if (and (= (nth$ ?kind-index ?parents) 0) (nth$ ?kind-index ?truths)) then
        (bind ?satisfied-roots (create$ ?satisfied-roots ?id))))
    (bind ?facts (create$ ?facts ?fact)))
  (modify ?grounded (facts ?facts) (leaves ?leaves) (satisfied ?satisfied-roots)
                    (counts (fact-slot-value ?tree counts)))
  ; last, because the function needs the complete lists of the grounded tree
  (progn$ (?place ?equal-places) (grounded-pddl-tree-set ?grounded ?place TRUE)))

(deffunction pddl-grounding-for-tree
  "Assert and return a pddl-grounding, named after the first root formula of a tree."
  (?tree ?names ?values)
  (return (assert (pddl-grounding
    (id (sym-cat grounding- (nth$ 1 (fact-slot-value ?tree ids)) - (gensym*)))
    (param-names ?names) (param-values ?values)))))

(deffunction grounded-pddl-tree-drop
  "Retract a grounded tree with its facts. The tree and its leaves refer to each other, so that CLIPS
   would keep these facts forever. Therefore the tree drops its references first."
  (?grounded)
  (bind ?facts (create$ (fact-slot-value ?grounded leaves) (fact-slot-value ?grounded facts)))
  (modify ?grounded (leaves) (facts))
  (retract ?grounded)
  (progn$ (?fact ?facts) (if (fact-existp ?fact) then (retract ?fact))))

(deffunction ground-pddl-formula
  "Ground the formulas that are part-of ?parent-id, in the grounding ?grounding-id, or in a new
   grounding if no grounding has this id. Return the id of the grounding; without formulas return
   ?grounding-id."
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
  "Assert a grounded-pddl-predicate for each predicate that is part-of ?parent-id. For agents that use
   Fawkes' function: the core grounds whole trees, and does not need the arguments of predicates."
  (?parent-id ?param-names ?param-values ?grounding-id)
  (do-for-all-facts ((?p pddl-predicate)) (eq ?p:part-of ?parent-id)
    (assert (grounded-pddl-predicate (id (sym-cat grounded- ?p:id - ?grounding-id))
                                     (predicate-id ?p:id) (grounding ?grounding-id)))))

(deffunction domain-retract-grounding
  "Retract a grounding with its facts; actions that refer to the grounding get a new one."
  (?grounding-id)
  (delayed-do-for-all-facts ((?t grounded-pddl-tree)) (eq ?t:grounding ?grounding-id)
    (grounded-pddl-tree-drop ?t))
  (delayed-do-for-all-facts ((?g pddl-grounding)) (eq ?g:id ?grounding-id)
    (retract ?g))
  ; nil: the action has no grounding
  (do-for-all-facts ((?a plan-action))
      (and (neq ?grounding-id nil) (eq ?a:precondition ?grounding-id))
    (modify ?a (precondition nil))))

(defrule domain-amend-action-params
  "An action with values but no names gets the names from its operator."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 5)))
  ?action <- (plan-action (action-name ?operator) (param-names) (param-values ? $?))
  (domain-operator (name ?operator) (param-names $?names&:(> (length$ ?names) 0)))
  =>
  (modify ?action (param-names ?names)))

(defrule domain-ground-plan-action-precondition
  "Ground the precondition of an action before its execution. Actions with another number of
   parameters than the operator are not grounded, as in Fawkes."
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
  "Ground the conditions of the effects of an action that has succeeded, in the grounding of the
   precondition."
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
  "The same for an action without precondition, in a new grounding. The lower salience lets an action
   with a precondition get its grounding first."
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
  "No conditional effect applies until its condition is checked."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator) (precondition ?id&~nil))
  (domain-operator-effects (operator ?operator) (conditional ? $?))
  (not (domain-met-conditions (grounding ?id)))
  =>
  (assert (domain-met-conditions (grounding ?id))))

; --- clean-up
;
; domain-wipe, and the rules below that find an unneeded or outdated grounding, retract only the
; pddl-grounding. Then domain-grounding-cleanup retracts its grounded trees, and
; domain-grounding-cleanup-action removes its id from actions, which may be grounded again.

(defrule domain-grounding-of-finished-action
  "A finished action needs no grounding; domain-grounding-without-action retracts the former one."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?action <- (plan-action (state FINAL|FAILED) (precondition ~nil))
  =>
  (modify ?action (precondition nil)))

(defrule domain-grounding-without-action
  "The action of the grounding is finished, was retracted, or has another grounding."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  (grounded-pddl-tree (grounding ?id) (of-action TRUE) (grounding-fact ?grounding))
  (not (plan-action (precondition ?id)))
  =>
  ; another tree of the same grounding may have fired this rule before
  (if (fact-existp ?grounding) then (retract ?grounding)))

(defrule domain-retract-grounding-for-plan-action-if-precondition-mismatch
  "The arguments of the action have changed: retract the grounding of its former arguments."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 50)))
  ?grounding <- (pddl-grounding (id ?id) (param-values $?values))
  (plan-action (precondition ?id) (param-values ~$?values))
  =>
  (retract ?grounding))

(defrule domain-grounding-is-outdated
  "The condition has changed, so that its former pddl-formula-tree was retracted."
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
  "The decision about conditional effects is not needed after the effects are applied."
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

; The salience of the rules below is one less than that of checking, so that they fire after the lookup of
; all atoms: a formula may be satisfied for a moment while some of its atoms are out of date.

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
  "An action without grounding is executable, as in Fawkes: there is no formula, no operator, or
   another number of parameters than the operator's."
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  ?action <- (plan-action (executable FALSE) (precondition nil) (state ~FINAL&~FAILED))
  =>
  (modify ?action (executable TRUE)))

(defrule domain-check-effect-condition
  "The condition of a conditional effect is satisfied: add the effect to those that apply."
  (declare (salience (- ?*SALIENCE-DOMAIN-CHECK* 1)))
  (plan-action (state EXECUTION-SUCCEEDED) (precondition ?id&~nil) (action-name ?operator))
  (domain-operator-effects (operator ?operator) (conditional $? ?effect $?))
  (grounded-pddl-tree (grounding ?id) (root ?effect) (satisfied ? $?))
  ?met <- (domain-met-conditions (grounding ?id) (effects $?effects&~:(member$ ?effect ?effects)))
  =>
  (modify ?met (effects ?effects ?effect)))

; domain-index.clp - an index of the domain model
;
; CLIPS hashes joins on fields, but not on multifields, so each ground atom has a symbol as its key.
; Lists collect the conditions and effects, so that actions of rules need not search all facts.
; Logical support updates facts that are derived from the model; a list is made again if it lacks
; an element, or has an element that is gone.
;
; The rules fire in the order of their saliences: that of grounding plus 40 (retract outdated lists),
; 30 (derive facts), 25 (mark built trees), 20 (retract incomplete lists), 10 (collect lists) and 0 (use
; the lists). After a change, all lists are complete before the first condition is grounded.
;
; Patterns such as (type ?) accept any value. They show on which slots a list depends; CLIPS matches a
; modified fact again with all its patterns anyway.

(deftemplate domain-true-atom
  "The key of a domain-fact (domain-atom-key), for joins on one field."
  (slot key) (multislot values) (slot fact))

(deftemplate domain-value
  "The value of a value predicate; the key is that of the predicate with its other arguments."
  (slot key) (multislot arguments) (slot predicate) (slot value))

(deftemplate pddl-formula-node
  "A formula or predicate in the condition of root: an operator, an effect, or the name of an
   agent's own formula."
  (slot id) (slot root))

(deftemplate pddl-formula-tree
  "The condition of a root, as lists with one field for each node, parents before children."
  (slot root) (slot revision (default-dynamic (gensym*)))
  ; FALSE until the nodes of a tree that a function has built are indexed
  (slot settled (default FALSE))
  ; of each node: its pddl-formula or pddl-predicate, its type (or predicate, equality, comparison)
  (multislot ids) (multislot sources) (multislot kinds)
  ; the position of the parent (0: the node is a root), and the number of children
  (multislot parents) (multislot sizes)
  ; while no atom is satisfied: the truth of the node, and the number of satisfied children
  (multislot truths) (multislot counts))

(deftemplate domain-effect-spec
  "An effect on a declared predicate: the fact address of the domain-effect, and its fact index as
   its order."
  (slot operator) (slot name) (slot order) (slot effect) (slot sensed))

(deftemplate domain-operator-effects
  "The effects of an operator as fact addresses, in the order of the domain-effect facts: those on
   sensed predicates, and the others (direct)."
  (slot operator) (multislot orders) (multislot sensed) (multislot direct)
  ; the names of the conditional effects
  (multislot conditional))

(deffunction domain-atom-key
  "A symbol for a ground atom. Different values that print alike, such as the number 1 and a symbol of
   this spelling, have the same symbol. Therefore joins also compare the values."
  (?predicate ?values)
  (return (sym-cat ?predicate " " (implode$ ?values))))

(defrule domain-index-fact
  "Logical support retracts the key with its domain-fact."
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (logical ?f <- (domain-fact (name ?name) (param-values $?values)))
  =>
  (assert (domain-true-atom (key (domain-atom-key ?name ?values)) (values ?values) (fact ?f))))

(defrule domain-index-value
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (logical (domain-predicate (name ?name) (value-predicate TRUE))
           (domain-fact (name ?name) (param-values $?args ?value)))
  =>
  (assert (domain-value (key (domain-atom-key ?name ?args)) (arguments ?args)
                        (predicate ?name) (value ?value))))

(defrule domain-index-root
  "The root formula of a condition: of an operator, of an effect, or an agent's own."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula (id ?id) (part-of ?root) (type ?))
           (not (pddl-formula (id ?root))))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(defrule domain-index-formula
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula-node (id ?parent) (root ?root))
           (pddl-formula (id ?id) (part-of ?parent) (type ?)))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(defrule domain-index-predicate
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical (pddl-formula-node (id ?parent) (root ?root))
           (pddl-predicate (id ?id) (part-of ?parent) (predicate ?)
                           (param-names $?) (param-constants $?)))
  =>
  (assert (pddl-formula-node (id ?id) (root ?root))))

(deffunction pddl-node-truth
  "Whether a formula of ?size children, of which ?satisfied are satisfied, is satisfied."
  (?kind ?satisfied ?size)
  (switch ?kind
    (case conjunction then (= ?satisfied ?size))
    ; an empty negation is not satisfied, as in Fawkes
    (case negation then (and (> ?size 0) (= ?satisfied 0)))
    ; a disjunction, an atom (with one child), and leaves, which have no children
    (default (> ?satisfied 0))))

(deffunction pddl-node-kind
  "The kind of a leaf: predicate, equality or comparison."
  (?predicate)
  (switch ?predicate
    (case EQUALITY then equality)
    (case < then comparison) (case > then comparison) (case <= then comparison)
    (case >= then comparison) (case = then comparison)
    (default predicate)))

(deffunction pddl-formula-tree-build
  "Collect the nodes below root, level by level, into a new pddl-formula-tree and return it; FALSE
   without nodes. ?place is the position of the node whose children are collected; 0 is the root,
   which is not a node."
  (?root)
  (bind ?ids (create$)) (bind ?sources (create$)) (bind ?kinds (create$))
  (bind ?parents (create$)) (bind ?sizes (create$))
  (bind ?place 0) (bind ?id ?root)
  (while (<= ?place (length$ ?ids)) do
    (bind ?known-count (length$ ?ids))
    ; leaves have no children; nodes that are already collected are skipped, so that a cycle ends
    (if (not (member$ (nth$ ?place ?kinds) (create$ predicate equality comparison))) then
      (do-for-all-facts ((?f pddl-formula))
          (and (eq ?f:part-of ?id) (not (member$ ?f:id ?ids)))
        (bind ?ids (create$ ?ids ?f:id)) (bind ?sources (create$ ?sources ?f))
        (bind ?kinds (create$ ?kinds ?f:type)) (bind ?parents (create$ ?parents ?place)))
      ; a condition is a formula, so predicates directly below the root do not count
      (if (> ?place 0) then
        (do-for-all-facts ((?p pddl-predicate))
            (and (eq ?p:part-of ?id) (not (member$ ?p:id ?ids)))
          (bind ?ids (create$ ?ids ?p:id)) (bind ?sources (create$ ?sources ?p))
          (bind ?kinds (create$ ?kinds (pddl-node-kind ?p:predicate)))
          (bind ?parents (create$ ?parents ?place)))))
    (if (> ?place 0) then (bind ?sizes (create$ ?sizes (- (length$ ?ids) ?known-count))))
    (bind ?place (+ ?place 1))
    (bind ?id (nth$ ?place ?ids)))
  (if (= (length$ ?ids) 0) then (return FALSE))
  ; bottom up: the truth of the nodes while no atom is satisfied
  (bind ?truths (create$)) (bind ?counts ?sizes)
  (progn$ (?size ?sizes) (bind ?counts (replace$ ?counts ?size-index ?size-index 0)))
  (loop-for-count (?step 1 (length$ ?ids))
    ; from the last node to the first
    (bind ?place (- (length$ ?ids) ?step -1))
    (bind ?parent (nth$ ?place ?parents))
    (bind ?is-satisfied (pddl-node-truth (nth$ ?place ?kinds) (nth$ ?place ?counts)
                                         (nth$ ?place ?sizes)))
    (bind ?truths (create$ ?is-satisfied ?truths))
    (if (and ?is-satisfied (> ?parent 0)) then
      (bind ?counts (replace$ ?counts ?parent ?parent (+ (nth$ ?parent ?counts) 1)))))
  (return (assert (pddl-formula-tree
    (root ?root) (ids ?ids) (sources ?sources) (kinds ?kinds) (parents ?parents)
    (sizes ?sizes) (truths ?truths) (counts ?counts)))))

(defrule domain-index-tree
  "Build the tree again from its nodes after each change."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  (pddl-formula-node (root ?root))
  (not (pddl-formula-tree (root ?root)))
  =>
  (pddl-formula-tree-build ?root))

(defrule domain-index-tree-settles
  "The nodes of a tree that a function has built are indexed now."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 25)))
  ?tree <- (pddl-formula-tree (settled FALSE))
  =>
  (modify ?tree (settled TRUE)))

(defrule domain-index-tree-lacks-node
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 20)))
  (pddl-formula-node (id ?id) (root ?root))
  ?tree <- (pddl-formula-tree (root ?root) (ids $?ids&~:(member$ ?id ?ids)))
  =>
  (retract ?tree))

(defrule domain-index-tree-has-former-node
  "Retract the tree of a changed node before the node is indexed again."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 40)))
  ?tree <- (pddl-formula-tree (root ?root) (settled TRUE) (ids $? ?id $?))
  (not (pddl-formula-node (id ?id) (root ?root)))
  =>
  (retract ?tree))

(defrule domain-index-effect
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 30)))
  (logical ?e <- (domain-effect (name ?name) (part-of ?operator) (predicate ?predicate))
           (domain-predicate (name ?predicate) (sensed ?sensed)))
  =>
  (assert (domain-effect-spec (operator ?operator) (name ?name) (sensed ?sensed) (effect ?e)
                              (order (fact-index ?e)))))

(deffunction domain-fact-is-later
  "Whether the first fact is newer, for sort, which puts the newer fact behind the older one."
  (?a ?b)
  (> (fact-index ?a) (fact-index ?b)))

(defrule domain-index-operator-effects
  "Collect the effects of an operator again after each change."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  (logical (domain-operator (name ?operator)))
  (not (domain-operator-effects (operator ?operator)))
  =>
  (bind ?orders (create$)) (bind ?sensed (create$)) (bind ?direct (create$))
  (do-for-all-facts ((?spec domain-effect-spec)) (eq ?spec:operator ?operator)
    (bind ?orders (create$ ?orders ?spec:order))
    (if (eq ?spec:sensed TRUE)
     then (bind ?sensed (create$ ?sensed ?spec:effect))
     else (bind ?direct (create$ ?direct ?spec:effect))))
  (assert (domain-operator-effects (operator ?operator) (orders ?orders)
    (sensed (sort domain-fact-is-later ?sensed))
    (direct (sort domain-fact-is-later ?direct)))))

(defrule domain-index-operator-lacks-effect
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 20)))
  (domain-effect-spec (operator ?operator) (order ?order))
  ?effects <- (domain-operator-effects (operator ?operator)
                                       (orders $?orders&~:(member$ ?order ?orders)))
  =>
  (retract ?effects))

(defrule domain-index-operator-has-former-effect
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 40)))
  ?effects <- (domain-operator-effects (operator ?operator) (orders $? ?order $?))
  (not (domain-effect-spec (operator ?operator) (order ?order)))
  =>
  (retract ?effects))

(defrule domain-index-effect-is-conditional
  "A condition has the name of the effect as its root."
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  (pddl-formula-tree (root ?name))
  (domain-effect-spec (name ?name) (operator ?operator))
  ?effects <- (domain-operator-effects (operator ?operator)
                                       (conditional $?names&~:(member$ ?name ?names)))
  =>
  (modify ?effects (conditional ?names ?name)))

(defrule domain-index-effect-is-unconditional
  (declare (salience (+ ?*SALIENCE-DOMAIN-GROUND* 10)))
  ?effects <- (domain-operator-effects (conditional $?before ?name $?after))
  (not (pddl-formula-node (root ?name)))
  =>
  (modify ?effects (conditional ?before ?after)))

(defrule domain-check-value-predicate-must-have-only-one-value
  "Logical support retracts the error with its cause."
  (logical (domain-value (key ?key) (predicate ?predicate) (arguments $?args) (value ?value))
           (domain-value (key ?key) (predicate ?predicate) (arguments $?args)
                         (value ?other&~?value)))
  =>
  (domain-report value-predicate-with-multiple-values
    "Value predicate " ?predicate "(" (implode$ ?args) ") has multiple values ("
    ?value ", " ?other ")"))
